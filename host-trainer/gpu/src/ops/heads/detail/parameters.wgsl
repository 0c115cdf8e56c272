struct Parameters {
    n_items: u32,
    n_offsets: u32,
    // Features, then three of a colour.
    n_inputs: u32,
}

var<immediate> parameters: Parameters;
