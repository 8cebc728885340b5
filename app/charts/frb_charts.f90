program frb_charts
    use frb_dmv, only: dmv_body
    use frb_rotation_splitting, only: rotation_steps
    use frb_runge_kutta, only: rk4_steps
    use frb_taylor_truth, only: taylor_flow
    implicit none
end program frb_charts
