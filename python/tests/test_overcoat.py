"""What Python sees is what Rust computes, as arrays."""

import ast
import inspect
import pathlib
import threading

import numpy as np
import overcoat
import pytest

VELVET = """surface velvet(color ground = color(0.6, 0.1, 0.05) [[ float min = 0, float max = 1 ]],
    float roughness = 0.3 [[ float min = 0.07, float max = 1 ]], int on = 1, string model = "conty_kulla")
{
    Ci = ground * diffuse(N);
    if (on) Ci = sheen(Ci, N, 1, roughness, "model", model);
}"""


@pytest.fixture
def velvet():
    return overcoat.compile(VELVET, "velvet.osl")


def uniform(n, seed=1):
    return np.random.default_rng(seed).random((n, 3), dtype=np.float32)


def sphere(n):
    w = np.random.default_rng(2).normal(size=(n, 3)).astype(np.float32)
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def test_lambert_is_lambert():
    bsdf = overcoat.compile("Ci = color(0.2, 0.4, 0.6) * diffuse(N);").shade()
    wi = sphere(1000)
    f_cos, pdf = bsdf.eval(wi)
    cos = np.maximum(wi[:, 2], 0)
    np.testing.assert_allclose(f_cos, cos[:, None] * np.array([0.2, 0.4, 0.6]) / np.pi, atol=1e-6)
    np.testing.assert_allclose(pdf, cos / np.pi, atol=1e-6)
    assert f_cos.dtype == pdf.dtype == np.float32 and f_cos.shape == (1000, 3)
    assert bsdf.albedo == pytest.approx([0.2, 0.4, 0.6])
    assert bsdf.flags == overcoat.REFLECT | overcoat.DIFFUSE


def test_samples_average_to_the_albedo(velvet):
    wo = np.array([0.6, 0, 0.8], dtype=np.float32)
    bsdf = velvet.shade(wo=wo)
    s = bsdf.sample(uniform(100_000))
    np.testing.assert_allclose(s.weight.mean(axis=0), velvet.albedo([wo])[0], rtol=0.01)
    f_cos, pdf = bsdf.eval(s.wi)
    drawn = s.pdf > 0
    np.testing.assert_allclose(pdf[drawn], s.pdf[drawn], rtol=1e-3, atol=1e-5)
    assert set(s.flags[drawn]) <= {overcoat.REFLECT | overcoat.DIFFUSE, overcoat.TRANSMIT | overcoat.DIFFUSE}
    assert (s.eta[drawn] == 1).all() and (s.roughness[drawn] == 1).all()


def test_holes_let_light_through():
    bsdf = overcoat.compile("Ci = 0.5 * diffuse(N) + color(0.1, 0.2, 0.3) * transparent() + 2 * emission();").shade()
    assert bsdf.transparency == pytest.approx([0.1, 0.2, 0.3])
    assert bsdf.emission[0] > 0
    assert bsdf.flags & overcoat.NULL and bsdf.flags & overcoat.EMISSION
    s = bsdf.sample(uniform(1000))
    straight = (s.flags & overcoat.DELTA) != 0
    assert straight.any() and np.allclose(s.wi[straight], [0, 0, -1])


def test_arrays_of_other_kinds_and_shapes(velvet):
    bsdf = velvet.shade()
    wi = sphere(50)
    expected = bsdf.eval(wi)[0]
    np.testing.assert_array_equal(bsdf.eval(wi.astype(np.float64).tolist())[0], expected)
    np.testing.assert_array_equal(bsdf.eval(wi[::2].copy())[0], expected[::2])
    assert bsdf.eval(np.zeros((0, 3), np.float32))[0].shape == (0, 3)
    for wrong in (np.zeros((4, 2)), np.zeros((3, 4))):
        with pytest.raises(ValueError):
            bsdf.eval(wrong)
    with pytest.raises((TypeError, ValueError)):
        bsdf.eval(np.zeros(3))
    assert np.isfinite(bsdf.eval(np.full((3, 3), np.nan))[0]).all()


def test_strided_views_are_read_right(velvet):
    bsdf = velvet.shade()
    wi = sphere(40)
    table = np.zeros((40, 8), np.float32)
    table[:, 2:5] = wi
    np.testing.assert_array_equal(bsdf.eval(np.ascontiguousarray(table[:, 2:5]))[0], bsdf.eval(wi)[0])


def test_parameters(velvet):
    assert velvet.name == "velvet"
    assert velvet.params["roughness"] == pytest.approx(0.3)
    before = velvet.shade()
    velvet.set(ground=(0, 0, 1), roughness=0.5, on=0)
    assert velvet.params["ground"] == [0, 0, 1] and velvet.params["on"] == 0
    assert velvet.shade().albedo == pytest.approx([0, 0, 1])
    assert before.albedo[0] > 0.1, "a BSDF keeps the material it was shaded from"
    with pytest.raises(overcoat.ScriptError, match="did you mean `roughness`"):
        velvet.set(roughnes=0.5)
    with pytest.raises(overcoat.ScriptError):
        velvet.set(on=1, ground="red")
    assert velvet.params["on"] == 0
    with pytest.raises(TypeError):
        velvet.set(ground=[1, 2])
    assert overcoat.compile(VELVET, on=0).tree()["kind"] == "mul"


def test_errors_have_places():
    with pytest.raises(overcoat.ScriptError) as caught:
        overcoat.compile("float x = 1;\nCi = difuse(N);", "typo.osl")
    file, line, column, code, message = caught.value.places[0]
    assert (file, line, column) == ("typo.osl", 2, 6) and code.startswith("E") and "difuse" in message
    assert "did you mean `diffuse`?" in str(caught.value)
    with pytest.raises(ValueError, match="tier"):
        overcoat.Engine(tier="best")


def test_check_and_furnace(velvet):
    report = velvet.check()
    assert report.verdict == "conserves" and report.bound <= 1.0001 and report.witness is None
    gains = overcoat.compile("Ci = diffuse(N) + sheen(N, 0.4);").check()
    assert gains.verdict == "gains" and max(gains.witness[2]) > 1.0001
    white = overcoat.compile("Ci = sheen(diffuse(N), N, 1, 0.4);")
    directions = [[np.sin(a), 0, np.cos(a)] for a in np.linspace(0, 1.5, 9)]
    for side in ("view", "light"):
        albedo = white.albedo(directions, side)
        assert (albedo <= 1.0001).all() and (albedo > (0.8 if side == "view" else 0.3)).all()


def test_tree(velvet):
    tree = velvet.tree()
    assert tree["kind"] == "layer" and tree["top"]["name"] == "sheen_bsdf"
    assert tree["base"]["weight"] == pytest.approx([0.6, 0.1, 0.05])
    assert tree["top"]["params"]["roughness"] == pytest.approx(0.3)
    long = overcoat.compile("for (int i = 0; i < 5000; i++) Ci += 0.0001 * diffuse(normalize(N + i * dPdu));").tree()
    assert len(long["terms"]) == 5000


def test_render_gives_the_same_picture_for_the_same_seed(velvet):
    picture = velvet.render(size=24, spp=2)
    assert picture.shape == (24, 24, 3) and picture.dtype == np.float32
    assert np.isfinite(picture).all() and picture.mean() > 0.01
    np.testing.assert_array_equal(picture, velvet.render(size=24, spp=2, threads=1))
    assert (velvet.render(size=24, spp=2, seed=1) != picture).any()
    with pytest.raises(RuntimeError, match="0 samples"):
        velvet.render(spp=0)


def test_threads(velvet):
    wi, results = sphere(200_000), [None] * 4
    expected = velvet.shade().eval(wi)[0]

    def work(k):
        results[k] = velvet.shade().eval(wi)[0]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((r == expected).all() for r in results)


def test_plots(velvet):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    assert len(overcoat.plot.lobe(velvet).lines) == 4
    plt.figure()
    assert len(overcoat.plot.furnace(velvet, count=3).lines) == 7
    plt.figure()
    assert overcoat.plot.picture(velvet, size=16, spp=1).images


@pytest.mark.parametrize("page", ["python/README.md", "docs/embedding.md"])
def test_listings_of_the_pages_run(page):
    """Line by line; a remark that is a word in quotes is what the line gives."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    text = (pathlib.Path(__file__).parents[2] / page).read_text()
    blocks = [rest.split("```")[0] for rest in text.split("```python\n")[1:]]
    assert blocks
    for block in blocks:
        names = {"np": np, "overcoat": overcoat, "wi": sphere(8), "u": uniform(8)}
        for line in block.splitlines():
            code, _, remark = line.partition("#")
            exec(code.strip(), names)
            if remark.strip().startswith("'"):
                assert eval(code.strip(), names) == ast.literal_eval(remark.strip())


def test_everything_is_documented_and_typed():
    stubs = ast.parse(pathlib.Path(overcoat.__file__).with_name("_overcoat.pyi").read_text())
    typed = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}
    for name in ("Engine", "Material", "Report", "Bsdf", "Samples"):
        cls = getattr(overcoat, name)
        assert cls.__doc__
        members = {m for m in vars(cls) if not m.startswith("_")}
        body = typed[name].body
        stubbed = {n.name for n in body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_")}
        stubbed |= {n.target.id for n in body if isinstance(n, ast.AnnAssign)}
        assert members == stubbed, name
        for member in members:
            assert inspect.getdoc(getattr(cls, member)), f"{name}.{member}"
