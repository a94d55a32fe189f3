//! What a perfect measurement of a synthetic recording would read.

use std::io::Write;
use std::path::Path;

use crate::error::{Error, Result};
use crate::output::{Temporary, temporary_beside};

/// The truth of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Frame of the file, from 0.
    pub frame: u64,
    /// Its stamp: the middle of its exposure (of the middle row's, with a rolling shutter).
    pub t_s: f64,
    /// Centres of the marks, top to bottom, in the picture as seen, at the middle of their own exposure.
    ///
    /// A mark that accelerates is smeared off its mid-exposure position by a T²/24: 0.01 px at 20 000 px/s² and 4 ms. The lens maps the
    /// centre, not the disc: the disc's centroid lies up to 3 k₁ r R² / f² beside it (0.007 px for k₁ = 0.1, f = 1200 px,
    /// a mark of radius R = 11 px at r = 300 px).
    pub marks_px: Vec<[f64; 2]>,
    /// Angles at the stamp, as seen: camera effects included, lens and rolling shutter not.
    pub theta_rad: Vec<f64>,
}

/// Writes the table `frame,t_s,m1_x_px,…,theta1_rad,…`.
///
/// # Errors
/// An error of the writer.
pub fn write_csv(rows: &[Truth], out: impl Write) -> csv::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    if let Some(first) = rows.first() {
        let mut header = vec!["frame".to_owned(), "t_s".to_owned()];
        for mark in 1..=first.marks_px.len() {
            header.extend([format!("m{mark}_x_px"), format!("m{mark}_y_px")]);
        }
        header.extend((1..=first.theta_rad.len()).map(|i| format!("theta{i}_rad")));
        table.write_record(&header)?;
    }
    for row in rows {
        let mut record = vec![row.frame.to_string(), format!("{:.9}", row.t_s)];
        record.extend(row.marks_px.iter().flatten().map(|p| format!("{p:.5}")));
        record.extend(row.theta_rad.iter().map(|a| format!("{a:.9}")));
        table.write_record(&record)?;
    }
    table.flush()?;
    Ok(())
}

/// A truth table on its way to a file: written whole to a temporary beside it, then renamed by [`PendingTable::finish`].
pub struct PendingTable {
    file: Temporary,
}

impl PendingTable {
    /// Opens the temporary file, so that an unwritable folder shows before the work begins.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn beside(target: &Path) -> Result<Self> {
        if target.is_dir() {
            return Err(Error::unwritable(target, std::io::Error::other("it is a folder")));
        }
        Ok(Self { file: temporary_beside(target)? })
    }

    /// Writes the rows and gives the file its name.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; then nothing remains.
    pub fn finish(self, rows: &[Truth], target: &Path) -> Result<()> {
        let broken = |e: csv::Error| Error::unwritable(target, std::io::Error::other(e));
        write_csv(rows, self.file.as_file()).map_err(broken)?;
        self.file.persist(target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_names_every_column_with_its_unit() {
        let row = Truth { frame: 7, t_s: 0.25, marks_px: vec![[1.5, 2.0], [3.0, 4.0]], theta_rad: vec![0.5, -0.25] };
        let mut text = Vec::new();
        write_csv(&[row], &mut text).unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "frame,t_s,m1_x_px,m1_y_px,m2_x_px,m2_y_px,theta1_rad,theta2_rad\n\
             7,0.250000000,1.50000,2.00000,3.00000,4.00000,0.500000000,-0.250000000\n"
        );
    }
}
