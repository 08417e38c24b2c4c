"""Rigs of ordinary cameras: how their cameras are, and pictures of a rectified array from theirs."""
