"""A solid body from skeletons and widths ([PT] 2.2), and a skin through curves ([GC]).

``body_model`` measures cross sections, ``skin_texture`` unrolls a picture of the body, ``mesh``
joins both and ``mesh_files`` writes OBJ and glTF. ``pde_surface`` is a biharmonic surface through
four closed curves.
"""
