"""What a person looks at: pictures and tables of framebuffers, contact sheets, comparisons."""
