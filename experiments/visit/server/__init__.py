"""The visit server: pages and WebSockets for participants."""
