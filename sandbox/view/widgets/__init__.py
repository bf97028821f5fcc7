"""What the toolbar and the side panel are made of: a file for each kind of widget."""
