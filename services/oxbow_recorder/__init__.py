"""The recorder: layers from the bus into one rerun recording a mission. The only package that imports rerun."""
