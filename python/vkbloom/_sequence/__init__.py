"""Frames in time: what a sequence reads, what computes its frames, and the sequence itself."""
