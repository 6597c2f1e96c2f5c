ply
format ascii 1.0
