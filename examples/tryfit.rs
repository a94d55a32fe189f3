use freeswing::experiment::*; use freeswing::model::*; use freeswing::fit::*; use std::time::Instant; use rand::SeedableRng; use rand_distr::{Distribution, Normal};
fn main(){
 let mut rng=rand::rngs::StdRng::seed_from_u64(7);
 for (k,c,visc,noise,dur) in [(2e-4,2e-6,1e-7,3.5e-4,60.0),(2e-3,2e-5,4e-7,2e-3,40.0),(1e-5,2e-7,2e-7,3.5e-4,60.0),(6e-4,1e-5,0.0,3.5e-4,60.0)] {
  let mut e=Experiment::default(); e.model.k_eq_n_m_per_rad=k; e.model.c_eq_n_m_s_per_rad=c; e.model.effects.hinge_viscous=Some(visc);
  let m=ForwardModel::of(&e).unwrap();
  let s=State::at_rest(&[0.5,0.62]);
  let tr=Trajectory::swing(&m,&s,0.0,dur).unwrap();
  let nrm=Normal::new(0.0,noise).unwrap();
  let n=(dur*30.0) as usize;
  let t_s:Vec<f64>=(0..n).map(|i|i as f64/30.0).collect();
  let theta_rad:Vec<Vec<Option<f64>>>=(0..2).map(|l|t_s.iter().map(|t|Some(tr.at(*t).theta_rad[l]+nrm.sample(&mut rng))).collect()).collect();
  let rec=Record{path:"x".into(),t_s,relative_sd:vec![vec![1.0;n];2],theta_rad};
  let mut e0=Experiment::default(); e0.model.effects.hinge_viscous=Some(0.0);
  let t=Instant::now();
  let f=fit(&[rec],&e0,&[Parameter::JointStiffness,Parameter::JointDamping,Parameter::HingeViscous]);
  let d=t.elapsed();
  match f { Ok(f)=>{ println!("true {k:e} {c:e} {visc:e}: {d:?} steps {} {:?} coloured {} noise {:?} rmse {:?}",f.steps,f.ending,f.coloured,f.residuals[0].noise_rad,f.residuals[0].rmse_rad);
   for e in &f.estimates { println!("   {} = {:.5e} ± {:.2e} [{:.4e}, {:.4e}] bound {}",e.parameter,e.value,e.sd,e.low,e.high,e.at_bound); }
   println!("   undetermined {:?} outliers {:?}",f.undetermined,f.outliers);
   let v=Verdict::of(&f.residuals[0],1.0); println!("   departs {:?} peaks {}",v.departs,v.peaks[0].len());
  }, Err(e)=>println!("{e}") }
 }
}
