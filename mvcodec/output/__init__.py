"""Room 8: pictures and video files out."""
