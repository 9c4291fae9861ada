"""Videos, by PyAV: frames as pictures, and pictures as frames."""
