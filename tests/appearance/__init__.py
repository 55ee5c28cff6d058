"""Small glTF files as the world has them, drawn by this project and by VTK."""
