"""The twin's table, measured on machines that the pipeline does not know."""
