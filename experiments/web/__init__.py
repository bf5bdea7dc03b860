"""A person at the keyboard: the server, its worker processes, and the page in the browser."""
