//! Options of tests: one choice of a pipeline changed, the others left, and the choices of the pipeline that is drawn.

use resample_core::KernelShape;
use volsplat::{
    Classify, FieldOptions, KernelSheets, Order, RenderOptions, SampleOptions, SampleOrder,
};

/// The options with other choices of samples; of the defaults where they draw the field.
pub fn with_samples(
    mut options: RenderOptions,
    change: impl FnOnce(&mut SampleOptions),
) -> RenderOptions {
    let mut samples = options.samples().cloned().unwrap_or_default();
    change(&mut samples);
    options.order = Order::Samples(samples);
    options
}

/// The options with other choices of the field; of the defaults where they draw samples.
pub fn with_field(
    mut options: RenderOptions,
    change: impl FnOnce(&mut FieldOptions),
) -> RenderOptions {
    let mut field = options.field().cloned().unwrap_or_default();
    change(&mut field);
    options.order = Order::Field(field);
    options
}

/// The options with other choices of the slabs in which kernels are summed; of the defaults where they have none.
pub fn with_sheets(
    options: RenderOptions,
    change: impl FnOnce(&mut KernelSheets),
) -> RenderOptions {
    with_samples(options, |samples| {
        let mut sheets = samples.sheets().copied().unwrap_or_default();
        change(&mut sheets);
        samples.order = SampleOrder::ImageSheets(sheets);
    })
}

/// The choices of the field.
///
/// # Panics
/// Where samples are drawn.
pub fn field(options: &RenderOptions) -> &FieldOptions {
    options.field().expect("options of the field")
}

/// The choices of samples.
///
/// # Panics
/// Where the field is drawn.
pub fn samples(options: &RenderOptions) -> &SampleOptions {
    options.samples().expect("options of samples")
}

/// The choices of the slabs in which kernels are summed.
///
/// # Panics
/// Where something else is drawn.
pub fn sheets(options: &RenderOptions) -> &KernelSheets {
    samples(options).sheets().expect("options of kernel sheets")
}

/// The orders of classified samples.
pub fn classified_orders() -> [SampleOrder; 3] {
    let sheets = KernelSheets {
        classify: Classify::Pre,
        ..KernelSheets::default()
    };
    [
        SampleOrder::EverySample,
        SampleOrder::AxisSheets,
        SampleOrder::ImageSheets(sheets),
    ]
}

/// The options with sums of this kernel in slabs, post-classified.
pub fn summed(options: RenderOptions, kernel: KernelShape) -> RenderOptions {
    with_samples(options, |samples| {
        samples.kernel = kernel;
        samples.order = SampleOrder::ImageSheets(KernelSheets::default());
    })
}
