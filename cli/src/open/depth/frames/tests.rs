//! Pairs pictures, depths and cameras.

use super::*;

fn folder(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in names {
        std::fs::write(folder.path().join(name), "").expect("a file");
    }
    folder
}

fn words(items: &[Item]) -> Vec<(usize, Option<&str>, &str)> {
    let name = |item: &'_ Item| item.file.rsplit('/').next().map(str::len);
    items
        .iter()
        .map(|item| {
            let start = item.file.len() - name(item).unwrap_or(0);
            (item.number, item.time.as_deref(), &item.file[start..])
        })
        .collect()
}

#[test]
fn a_pattern_names_the_files_there_are_in_order() {
    let folder = folder(&[
        "a_10.png",
        "a_09.png",
        "a_9.png",
        "a_x.png",
        "b_01.png",
        "a_100.png",
    ]);
    let pattern = folder.path().join("a_%02d.png").display().to_string();
    let found = items(&pattern).expect("files").expect("a pattern");
    let expected = [
        (9, None, "a_09.png"),
        (10, None, "a_10.png"),
        (100, None, "a_100.png"),
    ];
    assert_eq!(words(&found), expected);
    let missing = folder.path().join("c_%d.png").display().to_string();
    assert!(items(&missing).is_err(), "no file of that name");
    assert!(items("one.png").expect("one file").is_none());
}

#[test]
fn a_list_has_names_and_perhaps_times() {
    let folder = folder(&[]);
    let list = folder.path().join("rgb.txt");
    std::fs::write(
        &list,
        "# timestamp name\n1305.25 rgb/a b.png\n\n1305.5 rgb/c.png\n",
    )
    .expect("a file");
    let found = items(&list.display().to_string())
        .expect("a list")
        .expect("a list");
    let expected = [
        (0, Some("1305.25"), "a b.png"),
        (1, Some("1305.5"), "c.png"),
    ];
    assert_eq!(words(&found), expected);
    std::fs::write(&list, "a.png\nb.png\n").expect("a file");
    let found = items(&list.display().to_string())
        .expect("a list")
        .expect("a list");
    assert_eq!(words(&found), [(0, None, "a.png"), (1, None, "b.png")]);
}

#[test]
fn a_depth_belongs_to_the_picture_of_its_time_or_number() {
    let item = |number, time: Option<&str>| Item {
        number,
        time: time.map(str::to_owned),
        file: String::new(),
    };
    let timed = [
        item(0, Some("1.00")),
        item(1, Some("1.04")),
        item(2, Some("1.08")),
    ];
    let of = |time: &str| partner(&item(7, Some(time)), &timed).map(|found| found.number);
    assert_eq!(
        (of("1.05"), of("1.015"), of("1.2")),
        (Some(1), Some(0), None)
    );
    let numbered = [item(3, None), item(5, None)];
    let of = |number| partner(&item(number, None), &numbered).map(|found| found.number);
    assert_eq!((of(5), of(4)), (Some(5), None));
}
