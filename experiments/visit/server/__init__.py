"""Server of the pages and WebSockets that participants use."""
