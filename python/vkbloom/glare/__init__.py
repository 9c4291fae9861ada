"""The stages of glare, which read what glows and add light to the bloom.

The field `Settings.glare` is a tuple of stages. The core declares their numbers
(``shaders/params.h``). `vkbloom.registry.STAGES` has the order of the stages.
"""
