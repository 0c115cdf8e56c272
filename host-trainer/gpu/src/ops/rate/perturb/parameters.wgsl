struct Parameters {
    n_rows: u32,
    width: u32,
    group: u32,
    first: u32,
    stream: u32,
}

var<immediate> parameters: Parameters;
