"""What is made of a bake besides its colours: pictures, and error against time."""
