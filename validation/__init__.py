"""What makes the committed evidence: run as `python -m validation.FOLDER.NAME`."""
