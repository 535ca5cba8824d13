"""Robot models of other programs (URDF, MJCF, xacro) as robot files.

``model_source`` reads XML with line numbers, ``urdf_source`` and ``mjcf_source`` prepare it for
MuJoCo, ``model_compiler`` compiles it. ``body_tree`` finds the spine, legs and passive wheels,
``chain_directions`` the directions of the chain, ``link_figures`` lengths, masses and radii,
``leg_pairs`` the legs. ``robot_import`` joins them.
"""
