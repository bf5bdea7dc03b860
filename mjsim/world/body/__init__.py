"""Physics simulation of the person's body and of the hands, which pick, carry and place objects."""
