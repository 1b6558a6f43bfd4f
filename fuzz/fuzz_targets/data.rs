//! Files of heights: any bytes are a function that has values and gradients everywhere it says, or are refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::Arc;
use winkler::error::{Place, Source};
use winkler::api::{Data, DataSpec, Detrend, Fill, Interpolation, Outside};

fuzz_target!(|bytes: &[u8]| {
    let file = std::env::temp_dir().join(format!("winkler-fuzz-{}", std::process::id()));
    std::fs::write(&file, bytes).expect("a temporary file");
    let source = Source { name: "scene.toml".to_owned(), text: "file".to_owned() };
    let place = Place { source: Arc::new(source), span: 0..4 };
    for points in [false, true] {
        for (interpolation, outside) in
            [(Interpolation::Linear, Outside::Clamp), (Interpolation::Cubic, Outside::Periodic)]
        {
            let (name, place, file) = ("f".to_owned(), place.clone(), file.clone());
            let (origin, spacing, missing) = ([0.0; 2], [1.0; 2], None);
            let (fill, detrend) = (Fill::Error, Detrend::None);
            let data = Data::new(DataSpec {
                name,
                file,
                place,
                points,
                origin,
                spacing,
                unit: 1.0,
                missing,
                fill,
                detrend,
                interpolation,
                outside,
            });
            match data.load() {
                Err(error) => assert!(!error.to_string().is_empty()),
                Ok(()) => {
                    // numbers near the end of their range make values beyond it
                    let tame =
                        data.numbers().all(|number| number.abs() < 1e100 && (number == 0.0 || number.abs() > 1e-100));
                    for place in [[0.0, 0.0], [0.5, 0.25], [-3.0, 1e3]] {
                        let sample = data.sample(&place[..data.arguments()]);
                        assert!(!tame || sample.value.is_finite(), "{sample:?} at {place:?}");
                    }
                    drop(data.grid().map(|grid| (grid.roughness(), grid.summits())));
                }
            }
        }
    }
});
