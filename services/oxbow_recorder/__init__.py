"""The recorder: layers from the bus into one rerun recording per mission. The only package that imports rerun."""
