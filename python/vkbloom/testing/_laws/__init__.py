"""The laws of a bloom, a module for each kind of them; `table.LAWS` has all."""
