//! The state of a run as named numbers and arrays.
//!
//! One function of each part both saves and restores it, and takes the part to pieces without `..`, so that a new
//! field is either in the state or left out by name.

use crate::error::{Error, Result};
use bytemuck::Pod;
use std::collections::BTreeMap;

/// An array of the state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Bytes of an element, for the shuffle: 1, 4 or 8.
    pub width: usize,
    /// The elements, as they lie in memory.
    pub bytes: Vec<u8>,
}

/// The state of a run, on its way out or in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Archive {
    saving: bool,
    /// It goes to the disk, and so must the files that it belongs to.
    lasting: bool,
    /// It is of another run, see [`Self::is_of_another`].
    of_another: bool,
    /// Single numbers, bit by bit.
    pub numbers: BTreeMap<String, u64>,
    /// Arrays.
    pub sections: BTreeMap<String, Section>,
}

impl Archive {
    /// An empty state, to be filled and written to the disk.
    pub fn new() -> Self {
        Self { saving: true, lasting: true, ..Self::default() }
    }

    /// An empty state, to be filled and kept in memory.
    pub fn in_memory() -> Self {
        Self { saving: true, ..Self::default() }
    }

    /// A state that was read, to be taken over.
    pub fn read(numbers: BTreeMap<String, u64>, sections: BTreeMap<String, Section>) -> Self {
        Self { numbers, sections, ..Self::default() }
    }

    /// The same state, to be taken over.
    pub fn to_restore(&self) -> Self {
        Self { saving: false, lasting: false, ..self.clone() }
    }

    /// The state itself, to be taken over.
    pub fn into_restore(self) -> Self {
        Self { saving: false, lasting: false, ..self }
    }

    /// The state itself, to be taken over by another run.
    pub fn into_beginning(self) -> Self {
        Self { of_another: true, ..self.into_restore() }
    }

    /// Whether values go into the state (or come out of it).
    pub fn is_saving(&self) -> bool {
        self.saving
    }

    /// Whether another run takes it over (`run.from`): where things are and how they move is the state's; what followed from the old
    /// run's laws and constants, and its sums, are not.
    pub fn is_of_another(&self) -> bool {
        self.of_another
    }

    /// Whether the state goes to the disk.
    pub(crate) fn is_lasting(&self) -> bool {
        self.lasting
    }

    fn missing(name: &str) -> Error {
        Error::misfit(format!(
            "the checkpoint holds no `{name}`: another version of seixo, or another case, wrote it"
        ))
    }

    /// A count.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if the state has none of this name; so with all of these.
    pub fn count(&mut self, name: &str, value: &mut u64) -> Result<()> {
        if self.saving {
            self.numbers.insert(name.to_owned(), *value);
        } else {
            *value = *self.numbers.get(name).ok_or_else(|| Self::missing(name))?;
        }
        Ok(())
    }

    /// A count that states of older versions lack: `value` stays as it is then.
    ///
    /// # Errors
    /// None so far.
    pub fn count_of_late(&mut self, name: &str, value: &mut u64) -> Result<()> {
        if self.saving || self.numbers.contains_key(name) { self.count(name, value) } else { Ok(()) }
    }

    /// A number that states of older versions lack: `value` stays as it is then.
    ///
    /// # Errors
    /// None so far.
    pub fn number_of_late(&mut self, name: &str, value: &mut f64) -> Result<()> {
        if self.saving || self.numbers.contains_key(name) { self.number(name, value) } else { Ok(()) }
    }

    /// A count of `what` that must be the same in the state and in the case.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] with both counts if they differ.
    pub fn same(&mut self, what: &str, count: u64) -> Result<()> {
        let mut held = count;
        self.count(what, &mut held)?;
        if held == count {
            return Ok(());
        }
        Err(Error::misfit(format!(
            "the checkpoint holds {held} {what}, the case {count}: their scenes differ"
        )))
    }

    /// A number, to the last bit.
    ///
    /// # Errors
    /// As [`Archive::count`].
    pub fn number(&mut self, name: &str, value: &mut f64) -> Result<()> {
        let mut bits = value.to_bits();
        self.count(name, &mut bits)?;
        *value = f64::from_bits(bits);
        Ok(())
    }

    /// A small count.
    ///
    /// # Errors
    /// As [`Archive::count`].
    pub fn small(&mut self, name: &str, value: &mut u32) -> Result<()> {
        let mut wide = u64::from(*value);
        self.count(name, &mut wide)?;
        *value = u32::try_from(wide).map_err(|_| Self::missing(name))?;
        Ok(())
    }

    /// A switch.
    ///
    /// # Errors
    /// As [`Archive::count`].
    pub fn switch(&mut self, name: &str, value: &mut bool) -> Result<()> {
        let mut wide = u64::from(*value);
        self.count(name, &mut wide)?;
        *value = wide != 0;
        Ok(())
    }

    /// An array, of the length that it has if `fixed`.
    ///
    /// # Errors
    /// As [`Archive::count`], and if the length differs.
    pub fn array<T: Pod>(&mut self, name: &str, values: &mut Vec<T>, fixed: bool) -> Result<()> {
        if self.saving {
            let width = if size_of::<T>().is_multiple_of(8) {
                8
            } else if size_of::<T>().is_multiple_of(4) {
                4
            } else {
                1
            };
            self.bytes(name, width, bytemuck::cast_slice(values).to_vec());
            return Ok(());
        }
        let section = self.sections.get(name).ok_or_else(|| Self::missing(name))?;
        let count = section.bytes.len() / size_of::<T>();
        if section.bytes.len() % size_of::<T>() != 0 || fixed && count != values.len() {
            let want = values.len();
            return Err(Error::misfit(format!("the checkpoint holds {count} of `{name}`, the case {want}")));
        }
        *values = bytemuck::pod_collect_to_vec(&section.bytes);
        Ok(())
    }

    /// [`Archive::array`] of its own length that only some cases of a scene have, as those in which a body is free:
    /// it stays as it is where the state holds none of it, and what the state holds is passed over where the case has
    /// none.
    ///
    /// # Errors
    /// As [`Archive::array`].
    pub fn array_of_some<T: Pod>(&mut self, name: &str, values: &mut Vec<T>) -> Result<()> {
        if self.saving || self.holds(name) && !values.is_empty() {
            return self.array(name, values, true);
        }
        Ok(())
    }

    /// Whether the state has elements of the array `name`.
    pub fn holds(&self, name: &str) -> bool {
        self.sections.get(name).is_some_and(|section| !section.bytes.is_empty())
    }

    /// Put in an array of elements of `width` bytes.
    pub fn bytes(&mut self, name: &str, width: usize, bytes: Vec<u8>) {
        self.sections.insert(name.to_owned(), Section { width, bytes });
    }

    /// Bytes of all arrays.
    pub fn size(&self) -> usize {
        self.sections.values().map(|s| s.bytes.len()).sum()
    }
}
