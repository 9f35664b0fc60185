"""What `import twbal` offers: each function is one of the commands, on values instead of files."""
