"""The server of a study with people: pages and WebSockets for participants."""
