"""The server for the pages and WebSockets that participants use."""
