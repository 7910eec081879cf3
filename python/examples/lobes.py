"""A tour in the style of a notebook: run it cell by cell, or as a whole:

    python python/examples/lobes.py lobes.png
"""

# %% A material
import sys

import matplotlib

if __name__ == "__main__" and len(sys.argv) > 1:
    matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import overcoat

cloth = overcoat.compile(
    """surface velvet(color ground = color(0.6, 0.1, 0.05) [[ float min = 0, float max = 1 ]],
                      float roughness = 0.3 [[ float min = 0.07, float max = 1 ]])
    {
        Ci = ground * diffuse(N);
        Ci = sheen(Ci, N, 1, roughness);
    }"""
)
print(cloth, cloth.params)
print(cloth.check())

# %% One point: a light sample, and BSDF samples that average to the albedo
bsdf = cloth.shade(wo=(0.6, 0, 0.8))
f_cos, pdf = bsdf.eval(np.array([[0, 0.6, 0.8]], dtype=np.float32))
samples = bsdf.sample(np.random.default_rng(1).random((100_000, 3), dtype=np.float32))
print("toward the light:", f_cos[0], "pdf", pdf[0])
print("albedo by sampling:", samples.weight.mean(axis=0), "by quadrature:", cloth.albedo([[0.6, 0, 0.8]])[0])

# %% Its lobe, its furnace, its picture
figure = plt.figure(figsize=(15, 4.5))
overcoat.plot.lobe(cloth, ax=figure.add_subplot(1, 3, 1, projection="polar"), channel=0)
overcoat.plot.furnace(cloth, ax=figure.add_subplot(1, 3, 2))
overcoat.plot.picture(cloth, size=256, spp=32, ax=figure.add_subplot(1, 3, 3))
figure.tight_layout()

# %%
if len(sys.argv) > 1:
    figure.savefig(sys.argv[1], dpi=100)
else:
    plt.show()
