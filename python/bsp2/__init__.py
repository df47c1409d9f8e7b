"""BSP²: solids as exact meshes of convex cells."""
