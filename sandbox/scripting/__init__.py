"""The functions of `import sandbox`: their arguments, checked, and what they return."""
