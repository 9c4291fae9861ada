"""Views of results: pictures and tables of framebuffers, contact sheets, comparisons."""
