"""What there is: the scene, its file, and the checks that refuse what cannot work."""
