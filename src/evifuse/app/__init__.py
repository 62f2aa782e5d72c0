"""The command line, its tables and pictures, and the chapter's figures."""
