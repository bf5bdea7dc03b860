"""What the person sees through the glasses: assistance conditions, HUD state and its drawing."""
