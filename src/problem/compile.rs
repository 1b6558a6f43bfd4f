//! The second pass of reading a scene.
//!
//! The first pass is serde's: it knows no more than the value that it reads. Places are spans then, expressions are
//! texts, and files have the names that were typed. This pass walks all settings once, with the [`Names`] that are
//! known when the whole scene is read: it gives places their texts, compiles expressions, and finds files.

use crate::data::Library;
use crate::error::{Error, Located, Place, Result, Source};
use crate::expression::KnownNames;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The texts that a scene is read from: its file and the options that change it. The spans of all values count through
/// one after the other.
#[derive(Debug, Clone, Default)]
pub struct Sources(Vec<(usize, Arc<Source>)>);

impl Sources {
    /// Add a text; return where its spans begin.
    pub fn add(&mut self, source: Arc<Source>) -> usize {
        let begin = self.0.last().map_or(0, |(begin, last)| begin + last.text.len() + 1);
        self.0.push((begin, source));
        begin
    }

    /// Return the place of a span, moved into its text and onto whole characters.
    pub fn place(&self, span: Range<usize>) -> Place {
        let Some((begin, source)) = self.0.iter().rev().find(|(begin, _)| *begin <= span.start) else {
            return Place::default();
        };
        let whole =
            |at: usize| (0..=(at - begin).min(source.text.len())).rev().find(|at| source.text.is_char_boundary(*at));
        let start = whole(span.start).unwrap_or(0);
        Place { source: source.clone(), span: start..whole(span.end).unwrap_or(0).max(start) }
    }
}

/// What the settings of a scene may refer to.
#[derive(Clone, Copy)]
pub struct Names<'a> {
    /// The texts.
    pub sources: &'a Sources,
    /// Folder of the scene file.
    pub folder: &'a Path,
    /// Space dimension.
    pub dimension: usize,
    /// Functions from files.
    pub data: &'a Library,
    /// Variables of expressions.
    pub variables: &'a [&'static str],
    /// Factors of load steps in expressions.
    pub factors: &'a [String],
    /// The factors of load steps, for the expressions that may have them.
    pub of_steps: &'a [String],
}

impl<'a> Names<'a> {
    /// Return the names that expressions may have.
    pub fn known(&self) -> KnownNames<'a> {
        KnownNames { variables: self.variables, factors: self.factors, data: self.data }
    }

    /// Return the same names with other variables.
    pub fn with<'b>(&self, variables: &'b [&'static str]) -> Names<'b>
    where
        'a: 'b,
    {
        Names { variables, ..*self }
    }

    /// Return the same names and the factors of load steps.
    pub fn in_steps(&self) -> Self {
        Self { factors: self.of_steps, ..*self }
    }
}

/// Settings that are completed by the second pass.
pub trait Compile {
    /// Give places their texts, compile expressions, find files.
    ///
    /// # Errors
    /// Texts that are no expression, files that are not there.
    fn compile(&mut self, names: &Names<'_>) -> Result<()>;
}

/// Implements [`Compile`] for a struct by its fields. Those after `else` have nothing to complete, or a function of the
/// struct completes them.
macro_rules! compile {
    ($type:ident { $($field:ident),* } else { $($other:ident),* } $(then $function:ident)?) => {
        impl $crate::problem::compile::Compile for $type {
            fn compile(&mut self, names: &$crate::problem::compile::Names<'_>) -> $crate::error::Result<()> {
                let Self { $($field,)* $($other: _,)* } = self;
                $($crate::problem::compile::Compile::compile($field, names)?;)*
                $(self.$function(names)?;)?
                Ok(())
            }
        }
    };
}
pub(crate) use compile;

macro_rules! complete {
    ($($type:ty),*) => { $(impl Compile for $type {
        fn compile(&mut self, _: &Names<'_>) -> Result<()> {
            Ok(())
        }
    })* };
}
complete!(bool, f64, usize, String);

impl Compile for Place {
    fn compile(&mut self, names: &Names<'_>) -> Result<()> {
        *self = names.sources.place(self.span.clone());
        Ok(())
    }
}

impl<T: Compile> Compile for Located<T> {
    fn compile(&mut self, names: &Names<'_>) -> Result<()> {
        self.place.compile(names)?;
        self.value.compile(names)
    }
}

macro_rules! each {
    ($($type:ty),*) => { $(impl<T: Compile> Compile for $type {
        fn compile(&mut self, names: &Names<'_>) -> Result<()> {
            self.iter_mut().try_for_each(|value| value.compile(names))
        }
    })* };
}
each!(Option<T>, Vec<T>, [T], [T; 2], [T; 3]);

/// A file that a setting names.
impl Compile for Located<PathBuf> {
    fn compile(&mut self, names: &Names<'_>) -> Result<()> {
        self.place.compile(names)?;
        find(self, names.folder)
    }
}

/// Join the path of a file with the folder of the scene. The file must be there.
///
/// # Errors
/// A file that is not there, with the name of one that is; a folder.
pub fn find(file: &mut Located<PathBuf>, folder: &Path) -> Result<()> {
    file.value = folder.join(&file.value);
    let Located { value: path, place } = file;
    match std::fs::metadata(&path) {
        Ok(found) if found.is_file() => Ok(()),
        Ok(_) => Err(Error::scene(place, format!("{} is not a file", path.display()))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let names: Vec<_> = files.map(|file| file.file_name().to_string_lossy().into_owned()).collect();
            let wanted = path.file_name().unwrap_or_default().to_string_lossy();
            let error = Error::scene(place, format!("there is no file {}", path.display())).label("not there");
            Err(error.suggest(&wanted, names.iter().map(String::as_str), || {
                "paths are relative to the folder of the scene file".to_owned()
            }))
        }
        Err(error) => Err(Error::scene(place, format!("cannot look at {}", path.display())).because(error.to_string())),
    }
}
