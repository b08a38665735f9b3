//! A film whose pictures and depths come one after another from the caller's memory.
//!
//! Takes the typed options once and a picture at a time, gives the picture that is drawn of it. The means and the background of
//! [`Film`] are kept from picture to picture. Limits: one camera for all of it.

use anyhow::{Result, bail};
use resample_core::Camera;
use warp3d::film::Film;
use warp3d::{Reference, Warper};

use crate::args::Warp3dArgs;
use crate::open::depth::cameras::{convergence, layout, targets};
use crate::open::depth::drawer::{Comfort, Converges, Drawer, LastPicture, film_options};
use crate::open::depth::scene::WarpScene;
use crate::open::depth::{check_words, film, scene};
use crate::picture::Drawn;
use crate::process::report::Notes;
use crate::values::input_file::{HeldPicture, HeldPictures, Source};

/// A film that its caller feeds.
pub struct FedFilm {
    args: Warp3dArgs,
    film: Option<Film>,
    drawer: Option<Drawer>,
    /// The picture that is added next.
    next: usize,
}

impl FedFilm {
    /// A film that is drawn with these options, those of films where nothing was typed.
    pub fn new(mut args: Warp3dArgs) -> Result<Self> {
        film::set_defaults(&mut args, None)?;
        check_words(&args)?;
        let cameras = &args.cameras;
        let unfit = [
            ("--sway", args.sequence.sway.is_some()),
            ("--path", args.sequence.path.is_some()),
            ("--reference", !cameras.reference.is_empty()),
            ("--neighbours", args.sequence.neighbours > 0),
            (
                "--max-error and --max-time",
                args.ask.max_error.is_some() || args.ask.max_time_ms.is_some(),
            ),
        ];
        if let Some((name, _)) = unfit.iter().find(|(_, is_given)| *is_given) {
            bail!("{name}: it does not go with the pictures of a film: leave it out");
        }
        Ok(Self {
            film: film_options(&args).map(Film::new),
            args,
            drawer: None,
            next: 0,
        })
    }

    /// Draws the next picture of the film.
    pub fn next(&mut self, picture: HeldPicture) -> Result<Drawn> {
        let mut words = self.args.clone();
        words.source = Source::Memory(HeldPictures(vec![picture]).into());
        let mut notes = match &mut self.drawer {
            Some(drawer) => std::mem::take(&mut drawer.notes),
            None => Notes::default(),
        };
        let mut scene = scene::read(&words, &mut notes)?;
        let (mut hidden, mut begins_shot) = (None, self.next == 0);
        if let (Some(film), [picture]) = (&mut self.film, &mut scene.references[..]) {
            let added = film.add(picture, None)?;
            (hidden, begins_shot) = (added.hidden, added.begins_shot);
        }
        let target = targets(&words, &scene)?[0];
        let number = self.next;
        let drawer = self.turned(&words, scene, hidden, (target, begins_shot, notes))?;
        let sheet = drawer.asked().sheet(&target).validated()?;
        let drawn = drawer.draw_silently(&sheet)?;
        self.next = number + 1;
        Ok(drawn)
    }

    /// The drawer, with the references of this picture.
    fn turned(
        &mut self,
        words: &Warp3dArgs,
        scene: WarpScene,
        hidden: Option<Reference>,
        (target, begins_shot, notes): (Camera, bool, Notes),
    ) -> Result<&mut Drawer> {
        let options = self.args.render.options.options()?;
        let seen = scene::seen_depths(&scene.references, &target);
        let asked = layout(words, &target, scene.nearest);
        let converges = match self.drawer {
            None => convergence(words, &scene, &target)?,
            Some(_) => f64::INFINITY,
        };
        let warper = Warper::with_hidden(scene.references, hidden, &options)?;
        let number = self.next;
        let drawer = match &mut self.drawer {
            Some(drawer) => {
                (drawer.warper, drawer.notes) = (warper, notes);
                drawer
            }
            empty @ None => empty.insert(Drawer {
                warper,
                source: None,
                layout: asked,
                comfort: Comfort::new(words, asked),
                convergence: converges,
                converges: Converges::of(words, &asked),
                notes,
                last: LastPicture::NotKept,
            }),
        };
        if let Some(seen) = seen.filter(|_| begins_shot) {
            drawer.begin_shot(&seen, &target, number);
        }
        Ok(drawer)
    }
}
