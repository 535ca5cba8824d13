"""A solid body from skeletons and widths ([PT] 2.2), and a skin that moves ([GC]).

``body_model`` measures cross sections, ``mesh`` joins them and ``skin_texture`` unrolls a picture.
``cross_sections`` makes closed curves or cuts them from a mesh, and ``pde_surface`` is the surface
through such curves. ``patches`` joins surfaces to a tube with fins. ``skin`` hangs the mesh on a
spine over time, and ``skin_file`` writes the animated glTF.
"""
