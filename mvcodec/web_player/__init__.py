"""The player that runs in the browser: built from `web/`, and the pages that hold it."""
