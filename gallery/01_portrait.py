"""The scanned head with the whole technique, in studio light: python gallery/01_portrait.py OUTPUT."""

import sys

import dermis

head = dermis.load_head("lee_perry_smith", subdivide=1)
scene = dermis.Scene(head, camera=dermis.portrait(head))
dermis.write_image(sys.argv[1], dermis.render(scene, size=(1024, 1024), atlas=2048, samples=8))
