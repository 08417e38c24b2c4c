"""Room 9: watching a file. A page in the browser, and the server that renders for it."""
