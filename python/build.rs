//! Has cargo alone link the extension where the system wants to be told that Python brings the symbols.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
