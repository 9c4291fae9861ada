"""The renderer: devices, sources, requests, plans and framebuffers."""
