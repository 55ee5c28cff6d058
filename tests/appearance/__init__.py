"""Small glTF files with features of real files, drawn by this project and by VTK."""
