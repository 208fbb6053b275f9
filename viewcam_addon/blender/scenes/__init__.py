"""Blender's scene as the tracer's, with a ledger of what could not come along; and the tracer's scene as Blender's."""
