"""The pages of the dashboard, drawn by NiceGUI."""
