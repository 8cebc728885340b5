program one_step
    use frb, only: wp
    implicit none
    print *, wp
end program one_step
