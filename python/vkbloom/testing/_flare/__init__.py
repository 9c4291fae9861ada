"""Flare reports by the standards: charts, pictures of them, figures, and the report."""
