import pytest
import torch

from twbal.core.errors import ConfigError
from twbal.models.kernels.expression import NAMES, build

PLACES = torch.tensor([[0.0, 0.0], [0.3, -1.0], [2.0, 0.5]], dtype=torch.float64)


@pytest.mark.parametrize(
    "expression",
    [*NAMES, "se + linear", "MaternKernel(nu=1.5)*periodic", "gpytorch.kernels.RQKernel", "(se+rq)*se"],
)
def test_kernels_are_covariances_of_each_output(expression):
    matrix = build(expression, 2, 3)(PLACES, PLACES).to_dense()
    assert matrix.shape == (3, 3, 3)
    assert torch.linalg.eigvalsh(matrix).min() > -1e-9
    assert torch.equal(matrix[0], matrix[2])  # parameters are 1 in the beginning


def test_sums_and_products_are_those_of_the_kernels():
    def of(expression):
        return build(expression, 2)(PLACES, PLACES).to_dense()

    torch.testing.assert_close(of("se+linear"), of("se") + of("linear"))
    torch.testing.assert_close(of("se*linear"), of("se") * of("linear"))
    torch.testing.assert_close(of("(se+rq)*matern52"), (of("se") + of("rq")) * of("matern52"))


def test_a_short_name_stands_for_its_class_and_arguments():
    one, other = (build(e, 2)(PLACES, PLACES).to_dense() for e in ("matern32", "gpytorch.kernels.MaternKernel(nu=1.5)"))
    assert torch.equal(one, other)


@pytest.mark.parametrize(
    ("expression", "reason"),
    [
        ("mattern52", "there is no kernel 'mattern52'"),
        ("", "it cannot be read"),
        ("se+", "it cannot be read"),
        ("se-linear", "'se - linear' is no kernel"),
        ("(" * 90 + "se" + ")" * 90, "it cannot be read|is no kernel|cannot be used"),
        ("se+" * 99 + "se", "it cannot be read"),
        ("MaternKernel(2.5)", r"'MaternKernel\(2.5\)' is no kernel"),
        ("MaternKernel(nu='x')", "arguments are numbers up to 100"),
        ("SpectralMixtureKernel(num_mixtures=100000)", "arguments are numbers up to 100"),
        ("MaternKernel(nu=0.7)", r"MaternKernel cannot be made of \{'nu': 0.7\} alone"),
        ("ScaleKernel", r"ScaleKernel cannot be made of \{\} alone"),
        ("CosineKernel", "it gives no covariance of vectors of 2 numbers"),
        ("RFFKernel(num_samples=5)", "it is drawn at random"),
        ("AdditiveKernel", "it is no kernel of vectors"),
        ("__import__('os').getcwd()", "is no kernel|there is no kernel"),
        ("os.system", "there is no kernel 'os.system'"),
        ("gpytorch.kernels.keops", "there is no kernel"),
    ],
)
def test_what_is_no_kernel_is_refused_with_the_names_that_are(expression, reason):
    if expression.startswith("((("):
        build(expression, 2)  # parentheses alone change nothing
        return
    with pytest.raises(ConfigError, match=reason) as caught:
        build(expression, 2)
    assert "Expected se, matern12, matern32, matern52" in str(caught.value)
