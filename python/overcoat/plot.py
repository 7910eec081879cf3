"""Plots of materials for notebooks. Needs matplotlib."""

import numpy as np


def _directions(degrees):
    """Unit vectors in the plane of x and z, `degrees` away from z."""
    angle = np.radians(np.asarray(degrees, dtype=np.float64))
    return np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=-1).astype(np.float32)


def lobe(material, degrees=(0, 30, 60, 80), ax=None, channel=1):
    """f·|cos| in the plane of incidence, for viewers so many degrees from the normal. Returns the axes (polar)."""
    import matplotlib.pyplot as plt

    if ax is None:
        ax = plt.subplot(projection="polar")
    # From -180 to 180 degrees: light from below counts too.
    angles = np.linspace(-180, 180, 721)
    directions = _directions(angles)
    for viewer in degrees:
        f_cos, _ = material.shade(wo=_directions(viewer)).eval(directions)
        ax.plot(np.radians(angles), f_cos[:, channel], label=f"viewer at {viewer}°")
    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    ax.set_title(f"{material.name}: f·|cos θ|")
    ax.legend(loc="lower left", fontsize="small")
    return ax


def furnace(material, count=24, ax=None):
    """Albedo over the angle, seen from the viewer and from the light: never above 1 if the material keeps energy."""
    import matplotlib.pyplot as plt

    if ax is None:
        ax = plt.subplot()
    angles = np.linspace(0, 89, count)
    for side, style in (("view", "-"), ("light", "--")):
        albedo = material.albedo(_directions(angles), side)
        for channel, color in enumerate(("tab:red", "tab:green", "tab:blue")):
            ax.plot(angles, albedo[:, channel], style, color=color, label=side if channel == 0 else None)
    ax.axhline(1, color="black", linewidth=0.8)
    ax.set(xlabel="degrees from the normal", ylabel="albedo", ylim=(0, 1.1), title=f"{material.name}: white furnace")
    ax.legend()
    return ax


def picture(material, size=256, spp=16, ax=None, **render):
    """A render of the material, encoded for a display. Keywords as for `Material.render`."""
    import matplotlib.pyplot as plt

    if ax is None:
        ax = plt.subplot()
    linear = np.clip(material.render(size, spp, **render), 0, 1)
    ax.imshow(np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))
    ax.set_axis_off()
    return ax
