"""The stages of glare beside the bloom: they read what glows and add light to the bloom.

Settings have a tuple of them, `Settings.glare`. The core declares their numbers
(``shaders/params.h``). `vkbloom.glare.base.STAGES` has the order of the stages.
"""
