//! Passes the linker the option for Python's symbols, which are resolved once Python has loaded the library.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
