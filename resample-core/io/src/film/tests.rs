//! Answers of `ffprobe`, and films through `ffmpeg` where it is installed.

use super::*;

#[test]
fn answers_become_facts() {
    let answer = "width=1920\nheight=1080\npix_fmt=yuv420p10le\ncolor_range=tv\ncolor_space=bt2020nc\ncolor_transfer=smpte2084\n\
                  color_primaries=bt2020\nr_frame_rate=30000/1001\navg_frame_rate=30000/1001\nrotation=-90\nstart_time=0.023\nstart_time=0.000\nduration=2.002\n";
    let facts = Facts::of_answers(
        answer,
        "codec_name=aac\n",
        "codec_name=subrip\ncodec_name=dvd_subtitle\n",
    )
    .expect("facts");
    assert_eq!(facts.size, [1080, 1920], "a phone held upright");
    let rate = FrameRate {
        numerator: 30_000,
        denominator: 1_001,
    };
    assert_eq!((facts.rate, facts.is_uneven), (rate, false));
    assert_eq!((facts.bits, facts.is_rgb), (10, false));
    assert_eq!(
        (facts.sound.as_deref(), facts.begins_s),
        (Some("aac"), 0.023)
    );
    assert_eq!(facts.subtitles, ["subrip", "dvd_subtitle"]);
    let original = Original {
        path: "film.mkv".into(),
        facts: facts.clone(),
    };
    let lost = [Container::Mp4, Container::WebM, Container::Matroska]
        .map(|container| original.lost_subtitles(container));
    assert_eq!(lost, [vec!["dvd_subtitle"], vec!["dvd_subtitle"], vec![]]);
    assert_eq!(facts.colours.matrix, "bt2020nc");
    assert!(!facts.is_panorama);
    let around = format!("{answer}projection=equirectangular\n");
    assert!(
        Facts::of_answers(&around, "", "")
            .expect("facts")
            .is_panorama
    );
    let uneven = "width=4\nheight=2\npix_fmt=yuv420p\nr_frame_rate=60/1\navg_frame_rate=2790/100\ncolor_space=unknown\n";
    let facts = Facts::of_answers(uneven, "", "").expect("facts");
    assert!(facts.is_uneven && facts.colours.matrix.is_empty() && facts.sound.is_none());
    assert!(
        Facts::of_answers("", "", "").is_err(),
        "a file of sound alone"
    );
    let huge = "width=4000000000\nheight=4000000000\n";
    assert!(Facts::of_answers(huge, "", "").is_err());
}

#[test]
fn pixel_formats_have_their_bits() {
    let of = |format: &str| {
        let answer = format!("width=1\nheight=1\npix_fmt={format}\n");
        let facts = Facts::of_answers(&answer, "", "").expect("facts");
        (facts.bits, facts.is_rgb)
    };
    let cases = [
        ("yuv420p", (8, false)),
        ("yuv420p10le", (10, false)),
        ("yuv444p12be", (12, false)),
        ("nv12", (8, false)),
        ("gray", (8, true)),
        ("gray16le", (16, true)),
        ("rgb48be", (16, true)),
        ("gbrp10le", (10, true)),
        ("yuvj420p", (8, false)),
    ];
    for (format, expected) in cases {
        assert_eq!(of(format), expected, "{format}");
    }
}

#[test]
fn a_film_is_known_by_its_first_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let is = |bytes: &[u8]| {
        let path = folder.path().join("film");
        std::fs::write(&path, bytes).expect("a file");
        is_film(&path)
    };
    assert!(is(b"\0\0\0\x20ftypisom"));
    assert!(is(b"\x1a\x45\xdf\xa3webm"));
    assert!(!is(b"\0\0\0\x20ftypavif"), "a still picture");
    assert!(!is(b"\x89PNG\r\n\x1a\n") && !is(b""));
    assert!(!is_film(&folder.path().join("missing")));
}
