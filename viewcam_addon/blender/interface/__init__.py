"""The interface that an artist touches: panels, buttons and menus, and in the viewport the diagram and its handles."""
