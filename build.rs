//! Compiles the C++ side of the bridge into the crate's static library.

fn main() {
    let sources = ["callbacks", "render", "scene", "status"].map(|name| format!("cpp_bridge/src/{name}.cpp"));
    cxx_build::bridge("src/bridge/mod.rs")
        .files(&sources)
        .include("cpp_bridge/include")
        .include("cpp_bridge/src")
        .std("c++17")
        .flag("-fvisibility=hidden")
        .warnings(true)
        .compile("segue_cpp_bridge");
    println!("cargo:rerun-if-changed=cpp_bridge");
}
