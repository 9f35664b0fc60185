"""Settings of the models f and g."""

from collections.abc import Iterator

from twbal.cli.settings.kinds import Number, OrNull, Part, Setting, Text, Whole, YesNo
from twbal.cli.settings.robot_settings import MEASURED

_POINTS = Whole(1, 1_000_000, "samples")


def _fit(place: str) -> Iterator[Setting]:
    """Of one search of hyper-parameters."""
    yield Setting(f"{place}.starts", Whole(1, 1000), "starts of the search of hyper-parameters")
    yield Setting(f"{place}.perturbation", Number(0.0, 10.0), "sd of the starts' logarithms")
    yield Setting(f"{place}.screening_points", _POINTS, "samples on which starts compete first")
    yield Setting(f"{place}.finalists", Whole(1, 1000), "different ends of these that go on to all samples, at most")
    yield Setting(f"{place}.iterations", Whole(1, 100_000), "L-BFGS iterations of a search, at most")
    yield Setting(f"{place}.max_signal_to_noise", Number(1.001, 1e9), "signal over noise where a penalty rises")
    yield Setting(f"{place}.max_relative_length_scale", Number(1.001, 1e9), "length-scale where a penalty rises")
    yield Setting(f"{place}.own_choices", Whole(0, 1000), "starts that do not compete; 0: all compete")
    for prior in ("length_scale_prior", "noise_prior"):
        yield Setting(f"{place}.{prior}", OrNull(Part()), f"log-normal {prior.replace('_', ' ')}; null: none")
        yield Setting(f"{place}.{prior}.log_mean", Number(-50.0, 50.0), "mean of the logarithm")
        yield Setting(f"{place}.{prior}.log_sd", Number(0.001, 50.0), "standard deviation of the logarithm")


MODEL = (
    *_fit("model.fit_f.settings"),
    *_fit("model.fit_f.settings.fit"),
    Setting("model.fit_f.settings.inducing", Whole(1, 100_000), "number of inducing inputs of a sparse f"),
    Setting("model.fit_f.settings.subset", _POINTS, "samples of the first fit of a sparse f"),
    Setting("model.fit_f.settings.tolerance", Number(0.0, 1e6, "nats"), "evidence that the inducing inputs may lose"),
    Setting("model.fit_f.settings.steps", Whole(1, 1_000_000), "minibatches of a variational f"),
    Setting("model.fit_f.settings.batch", _POINTS, "samples of a minibatch"),
    Setting("model.fit_f.settings.rate", Number(1e-6, 1.0), "learning rate of a variational f"),
    *_fit("model.fit_g.settings"),
    Setting("model.kernel", Text("kernels in sums and products"), "kernel of f and g"),
    Setting("model.keep_f_variance", YesNo(), "f + g has the variance of f too"),
    Setting("model.smoothing", OrNull(Part()), "smoothing of the states for g; null: none"),
    Setting("model.smoothing.rounds", Whole(1, 100), "rounds of smoothing and learning g"),
    Setting("model.smoothing.linearisations", Whole(1, 100), "linearisations of the smoother in a round"),
    Setting("model.smoothing.iterations", Whole(1, 100_000), "L-BFGS iterations for the noise levels, at most"),
    Setting("model.smoothing.sensor_prior_sd", Number(1e-4, 100.0), "prior sd of the logarithm of sensor noise"),
    Setting("model.smoothing.process_prior_sd", Number(1e-4, 100.0), "prior sd of the logarithm of process noise"),
    *(
        Setting(f"model.smoothing.sensor_sd.{name}", Number(1e-9, 1e4, unit), "noise of the data sheet's sensor")
        for name, unit in MEASURED.items()
    ),
)
