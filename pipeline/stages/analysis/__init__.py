"""Tables that analysts ask for; nothing on the way to a policy needs them."""
