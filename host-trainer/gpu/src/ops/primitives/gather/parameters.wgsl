struct Parameters {
    n_values: u32,
    width: u32,
}

var<immediate> parameters: Parameters;
