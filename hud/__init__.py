"""The heads-up display: assistance conditions, the HUD state that they make, and its drawing."""
