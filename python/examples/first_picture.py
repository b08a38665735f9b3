"""A volume of an array: the least there is to say."""

import numpy as np

import forward_resample as fr

z, y, x = np.mgrid[-1:1:96j, -1:1:96j, -1:1:96j]
torus = np.exp(-20 * ((np.hypot(x, y) - 0.6) ** 2 + z**2)).astype(np.float32)

picture = fr.volsplat(torus, transfer="magma", shade="phong", orbit=(30, 40), size=(480, 360), background="white")
picture.save("first_picture.png")
