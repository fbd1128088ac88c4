"""What a researcher needs around the model; its modules need Farside's extras, one by one."""
