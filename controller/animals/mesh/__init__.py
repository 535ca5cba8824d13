"""A solid body from skeletons and widths ([PT] 2.2), and a skin that moves ([GC]).

``body_model`` measures cross sections, ``skin_texture`` unrolls a picture of the body, ``mesh``
joins both and ``mesh_files`` writes and reads OBJ and glTF. ``cross_sections`` makes closed curves
of them or cuts these from a mesh, ``pde_surface`` is the surface through such curves, and
``patches`` joins surfaces to a tube with fins. ``bone_motion`` is a spine over time, ``skin`` hangs
the mesh on it and ``skin_file`` writes the animated glTF.
"""
