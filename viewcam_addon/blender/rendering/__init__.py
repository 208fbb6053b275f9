"""Pictures of a scene, by Cycles and by our own render engine, and the files that Blender writes of them."""
