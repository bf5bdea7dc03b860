"""The server of visits: pages and WebSockets for participants."""
