"""Custom methods: passes that are loaded at run time, in the syntax of mpv's user shaders."""
